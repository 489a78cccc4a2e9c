"""What to measure next, and what a plan can find: from suspects to the run that separates them."""
