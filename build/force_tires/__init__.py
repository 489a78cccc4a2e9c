"""Tires on a flat belt, of three families that share no code: plain, and with something hidden."""
