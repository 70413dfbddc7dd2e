"""Runs and the nominal model as a regression problem: residuals, columns, noise, Gauss-Newton; causes are judged
elsewhere.
"""
