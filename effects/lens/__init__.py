"""What a camera and its lens add: glow, beams, fringes, distortion, grain."""
