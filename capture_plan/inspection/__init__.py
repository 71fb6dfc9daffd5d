"""What a plan means for every single landmark and expression, and what happens where one is lost."""
