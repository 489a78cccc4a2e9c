"""What is measured with a model of it, as the inference takes it: strain, and forces."""
