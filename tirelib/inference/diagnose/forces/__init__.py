"""Which effect a brush lacks: the same procedure as on strain, on one force over its conditions."""
