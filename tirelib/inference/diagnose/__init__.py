"""Which physical effect is missing, by the inference of the library."""
