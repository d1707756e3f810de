"""What touches what, in results of contact."""

from collections.abc import Iterator

from pydrake.geometry import ContactSurface
from pydrake.multibody.plant import ContactResults


def surfaces(contacts: ContactResults) -> Iterator[ContactSurface]:
    """Yields the contact surfaces between bodies."""
    for i in range(contacts.num_hydroelastic_contacts()):
        yield contacts.hydroelastic_contact_info(i).contact_surface()
