"""The modelled chain in one piece: tire and effects to the strain waveform of every run."""
