"""From the best set to the answer: shrinkage on unseen runs, by what is chosen without them."""
