"""Contact: particles and sheets in, the foot of each particle, its gap and the pair of forces out.

contact (facets of four nodes, feet and normal forces), triangle_contact (of three), sheet_contact (any soup of facets:
which one a particle belongs to), friction.
"""
