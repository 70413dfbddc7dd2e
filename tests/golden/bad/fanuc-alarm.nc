(CC123 fanuc)
#3000=1
G0 X1
