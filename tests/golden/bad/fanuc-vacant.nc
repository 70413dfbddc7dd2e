(CC123 fanuc)
G0 X#101
