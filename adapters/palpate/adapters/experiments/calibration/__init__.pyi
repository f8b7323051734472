from .estimates import Estimate as Estimate
from .estimates import hole as hole
from .estimates import joined as joined
from .estimates import mean_of as mean_of
from .estimates import payload as payload
from .estimates import press as press
from .steps import Commissioning as Commissioning
