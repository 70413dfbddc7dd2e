(CC123 grbl)
G0 X[1+2]
