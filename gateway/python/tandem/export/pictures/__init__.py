"""What cameras see, as a data set has it: films, or files within the table; colours, and depth."""
