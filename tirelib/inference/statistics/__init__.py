"""The one inference of the library: likelihood, posterior, what plain tires show, and a verdict."""
