(CC139 fanuc)
G1 X10. ,C2. F100
