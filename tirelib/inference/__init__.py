"""From a campaign to a tire: what fits, where the model fails, which effect it lacks."""
