"""The claims of the five papers, each with the call that tests it and what it gives."""
