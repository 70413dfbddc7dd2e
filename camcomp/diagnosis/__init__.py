"""Why a machine and its model differ: the story of diagnose, its result, and the rooms of its parts."""
