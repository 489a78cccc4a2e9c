"""From the ring's deformation to the strain at the innerliner, and back."""
