"""What the BSDF plugin is made of: parameters, the table on the device, reflectance (Dr.Jit)."""
