"""A wheel transmitter that is played: its samples, its faults and where its bytes go."""
