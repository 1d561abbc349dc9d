"""Everything that touches the disk: height-field loaders, recipes, tables, the cache."""
