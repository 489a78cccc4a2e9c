"""What every room stands on: units, axes, flags, errors, tires' parameters, the compiled core."""
