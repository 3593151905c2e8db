"""What tools/scenes is made of: vectors and shapes, images, a glTF writer, and the scenes themselves."""
