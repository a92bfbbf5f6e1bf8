"""Figures of recordings and trains of impacts."""
