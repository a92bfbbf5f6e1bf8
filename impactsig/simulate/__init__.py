"""Motions of machines that hit a stop, and what instruments would have seen of them."""
