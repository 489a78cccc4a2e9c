"""Campaigns of plain tires, and of tires with something hidden, of three families."""
