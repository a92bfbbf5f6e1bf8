"""What a report says of a file, computed: channels chosen, impacts, dynamics, samples to show."""
