"""Camera images in the form for data sets: videos, or files in the tables; colours and depth."""
