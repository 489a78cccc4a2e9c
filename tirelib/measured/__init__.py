"""What was measured: strain in turns, their features, waveforms, the rig's values beside them."""
