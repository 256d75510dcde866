"""What bench/mitsuba, bench/cycles and bench/luxcore have in common: the same scene for both renderers, pictures compared, seconds to equal error."""
