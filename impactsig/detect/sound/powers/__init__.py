"""Power of a sound: narrow bands, their background, and gates filled."""
