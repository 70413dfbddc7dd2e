"""Parallel machines (Orthoglide, linear delta, 3-PUU): experiments whose causes are known."""
