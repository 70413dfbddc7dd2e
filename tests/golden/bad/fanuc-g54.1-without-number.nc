(CC129 fanuc)
G54.1
G0 X1.
