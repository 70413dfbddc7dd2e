"""From the best set to the answer: sizes, intervals, places, shrinkage on unseen runs."""
