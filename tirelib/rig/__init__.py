"""The numerical flat-belt rig: a virtual tire with five strain gages, made to test the library.

It shares no model code with tirelib. Its belt is geometrically exact, extensible and
shear-flexible; its tread is a field of bristles with Coulomb friction. See `docs/theory/rig.md`.
"""
