"""Adding effects to a model and removing them: refit, errors before and after, history."""
