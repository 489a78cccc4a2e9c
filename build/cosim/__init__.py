"""Co-simulation of vehicles with four virtual tires and four strain tires, driven by FMPy."""
