"""A corrected program and its proof: the story of compensate, verify and stream, with everything that only they
need.
"""
