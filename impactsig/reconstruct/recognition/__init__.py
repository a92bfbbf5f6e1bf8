"""Recognition of the kind of a series: periodic, quasi-periodic, noise, or else."""
