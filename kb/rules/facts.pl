:- module(kb_facts,
          [ load_facts/2,               % +Facts, -Count
            drop_facts/2,               % +Revision, -Dict
            tell/2,                     % +Fact, -Dict
            kind/3,                     % ?Revision, ?Individual, ?Class
            value/4,                    % ?Revision, ?Property, ?Subject, ?Value
            fluent/4,                   % ?Revision, ?Property, ?Subject, ?Value
            definition/4,               % ?Revision, ?Head, ?Frame, ?Body
            precondition/3,             % ?Revision, ?Head, ?Condition
            effect/4,                   % ?Revision, ?Head, ?Fluent, ?Value
            duration/3,                 % ?Revision, ?Head, ?Duration
            requires/3,                 % ?Revision, ?Name, ?Capability
            agent/3,                    % ?Revision, ?Head, ?Robot
            keeps_robot/2,              % ?Revision, ?Name
            claims/3,                   % ?Revision, ?Head, ?Resource
            odds/3,                     % ?Revision, ?Name, ?Odds
            learned/6,                  % ?Revision, ?Name, ?Robot, ?Where, ?Milliseconds, ?Odds
            takes_place/3,              % ?Revision, ?Head, ?Place
            recursive/2,                % ?Revision, ?Name
            parameter/4                 % ?Revision, ?Head, ?Variable, ?Class
          ]).

/** <module> The facts of the knowledge base, by revision

Every fact carries the revision that it belongs to, so that several knowledge bases live side by side
and a revision goes away whole. Facts come from kb/store.py alone; rules elsewhere are pure. Heads of
processes are terms `Name(Argument, ...)` with the arguments in the order of their parameter numbers.

  - definition(R, Head, Frame, Body): Body is the Golog program of a composite process; Frame stands
    for the invocation, so that its locals are told apart from those of other invocations.
  - duration(R, Head, Duration): `fixed(Milliseconds)` or `travel(Robot, Location, Milliseconds)`.
  - agent(R, Head, Robot): one for each robot that does the process, in order of parameter number; the
    first is the one that travels.
  - claims(R, Head, Resource): from its first step to its end the process uses the resource, which
    value(R, capacity, Resource, N) processes can do at once; one where there is no such value.
  - odds(R, Name, Odds): the process, which is one step, succeeds with this probability, in (0, 1].
  - learned(R, Name, Robot, Where, Milliseconds, Odds): where the process takes another time of that robot, or
    has other odds, `anywhere` or at(Location): these stand in for what duration/3 and odds/3 say.
  - takes_place(R, Head, Place): the process, of which something was learned, names the location where it is.
  - keeps_robot(R, Name): a robot that does this composite process does nothing else meanwhile.
  - recursive(R, Name): the process may perform itself, through others or not; it can end, and comes to
    itself only after a step.
  - parameter(R, Head, Variable, Class): a parameter of the process is an individual of Class.
  - fluent(R, Property, Subject, Value): what changes, as last told.
*/

:- dynamic
    kind/3, value/4, fluent/4, definition/4, precondition/3, effect/4, duration/3, requires/3,
    agent/3, keeps_robot/2, claims/3, odds/3, learned/6, takes_place/3, recursive/2, parameter/4.

%!  load_facts(+Facts:list, -Dict) is det.
%
%   Adds facts, each a callable term of one of the predicates above.

load_facts(Facts, _{count: Count}) :-
    forall(member(Fact, Facts), (fact(Fact), assertz(Fact))),
    length(Facts, Count).

fact(Fact) :-
    functor(Fact, Name, Arity),
    (   exported(Name/Arity)
    ->  true
    ;   throw(error(domain_error(fact, Fact), _))
    ).

exported(kind/3).       exported(value/4).        exported(fluent/4).
exported(definition/4). exported(precondition/3). exported(effect/4).
exported(duration/3).   exported(requires/3).     exported(agent/3).
exported(keeps_robot/2). exported(claims/3).       exported(odds/3).
exported(learned/6).      exported(takes_place/3).  exported(recursive/2).
exported(parameter/4).

%!  drop_facts(+Revision, -Dict) is det.

drop_facts(Revision, _{}) :-
    forall(( exported(Name/Arity), functor(Head, Name, Arity), arg(1, Head, Revision) ),
           retractall(Head)).

%!  tell(+Fact, -Dict) is det.
%
%   Fact is fluent(Revision, Property, Subject, Value): from now on, the property has this value.

tell(fluent(Revision, Property, Subject, Value), _{}) :-
    retractall(fluent(Revision, Property, Subject, _)),
    assertz(fluent(Revision, Property, Subject, Value)).
