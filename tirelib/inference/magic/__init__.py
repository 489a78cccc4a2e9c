"""The Magic Formula: fitted to forces, read from and written to property files (.tir)."""
