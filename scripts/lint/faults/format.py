quantities = {'force':1, 'moment': 2 }
