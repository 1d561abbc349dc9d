"""What a scene asks of its diffraction tables: paths through it, and the tables that suffice."""
