"""What several tests share: random models, slow and obvious references, small models by hand."""
