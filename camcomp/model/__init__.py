"""The machine as camcomp believes it to be, which compensation and diagnosis share; neither of them may be imported
here.
"""
