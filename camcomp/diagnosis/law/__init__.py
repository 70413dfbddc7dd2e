"""Which law does the unexplained residual follow: candidate terms, a sparse choice on withheld runs, a smooth map, and
a sentence.
"""
