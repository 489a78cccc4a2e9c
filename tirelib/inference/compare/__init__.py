"""Where a model fails: its prediction against a campaign, in units of the repeats' noise."""
