"""The rolling ring: one model of belt, sidewall, tread and road with large displacements."""
