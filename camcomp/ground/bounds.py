"""What is too much for any input, so that arithmetic stays finite and an answer comes soon."""

LARGEST_NUMBER = 1e18  # of any number, in mm, N, rad, s and what is made of them; a rigid drive is written as 1e14 N/mm
