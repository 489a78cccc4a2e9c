"""What a wheel sends: frames, samples, counts and clocks, whatever line and protocol."""
