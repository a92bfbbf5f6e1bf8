"""What force and sound share: samples as a stream, widths, order statistics, probabilities."""
