"""Work-precision and skip tables of impactsig, beside the tools a user would pick instead."""
