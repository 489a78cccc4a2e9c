"""Which physical effect is missing: a joint ranking held against variants of the model."""
