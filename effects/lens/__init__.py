"""Effects of a camera and its lens: glow, beams, fringes, distortion, grain."""
