"""Which sets of causes are fitted, how are they ranked, and is the residual above the noise floor?"""
