"""Times of samples: columns that hold them, the rate they show, and uneven ones made even."""
