"""A rolling continuum: a numerical tire of finite elements that shares no model with tirelib."""
