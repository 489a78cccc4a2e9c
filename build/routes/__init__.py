"""The dissertation's two routes to a tire's parameters, chapters 5 and 6, with intervals."""
