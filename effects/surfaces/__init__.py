"""What effects on scenes draw first: surfaces, textures, views and the maps of lights."""
