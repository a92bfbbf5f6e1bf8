"""Kernels that make events of crests: grouped, parted, and told from tails and ringing."""
