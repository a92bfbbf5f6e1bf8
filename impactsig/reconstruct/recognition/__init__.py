"""What kind of series this is: periodic, tones, noise, or none of them."""
