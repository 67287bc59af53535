"""What the data leave open of an image: samples of the regions that explain them."""
