"""Pictures from and to files: sequences, video, and pictures larger than memory."""
