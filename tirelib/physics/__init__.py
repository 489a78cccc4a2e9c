"""Equations of a tire: flexible ring, contact, strain of the innerliner, brush."""
