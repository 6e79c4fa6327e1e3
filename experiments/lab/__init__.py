"""The laboratory: experiments on programs that run as processes, and their tables."""
