:- module(planner_influence,
          [ called/3,                   % +Program, +Situation, -Names
            lasting/4,                  % +Condition, +Classes, +Names, +Situation
            independent/2,              % +Program, +Situation
            moves_others/2,             % +Names, +Situation
            waits/2,                    % +Program, +Situation
            program_part/4,             % +Program, +Names, +Situation, -Part
            asks/4,                     % +Part, +Situation, ?Property, ?Subject
            to_be_asked/4               % +Program, +Situation, ?Property, ?Subject
          ]).

/** <module> What one part of a program may change for another
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts), [agent/3, claims/3, definition/4, duration/3, effect/4, kind/3, parameter/4, precondition/3]).
:- use_module(planner_golog(projection)).

%!  called(+Program, +Situation, -Names) is det.
%
%   The processes that Program may come to, in order of name; looking ahead, what a process with a
%   duration model does is not looked into.

called(P0, S, Names) :-
    to_come(P0, P),
    names(P, S, [], Names0),
    sort(Names0, Names).

%   The program without the choices that have been taken, which it keeps as they were.
to_come(P, P) :- var(P), !.
to_come([P|Ps], [Q|Qs]) :- !, to_come(P, Q), to_come(Ps, Qs).
to_come(picked(_, _, P), Q) :- !, to_come(P, Q).
to_come(scope(Id, Head, P), scope(Id, Head, Q)) :- !, to_come(P, Q).
to_come(conc(Ps), conc(Qs)) :- !, maplist(to_come, Ps, Qs).
to_come(pconc(Ps), pconc(Qs)) :- !, maplist(to_come, Ps, Qs).
to_come(deadline(Ms, P), deadline(Ms, Q)) :- !, to_come(P, Q).
to_come(search(P), search(Q)) :- !, to_come(P, Q).
to_come(P, P).

names(P, S, Known, Names) :-
    findall(Name/Arity,
            ( sub_term(T, P), nonvar(T), ( T = call(_, _, Head) ; T = scope(_, Head, _) ),
              nonvar(Head), functor(Head, Name, Arity) ),
            Found0),
    sort(Found0, Found),
    foldl(names_of(S), Found, Known, Names).

names_of(S, Name/Arity, Known, Names) :-
    (   memberchk(Name, Known)
    ->  Names = Known
    ;   revision(S, Revision),
        functor(Head, Name, Arity),
        \+ ( duration(Revision, Head, _), ahead(S, _) ),
        definition(Revision, Head, _, Body)
    ->  names(Body, S, [Name|Known], Names)
    ;   Names = [Name|Known]
    ).

%!  changes(+Names, +Situation, ?Property, ?Subject, -Own, -Value) is nondet.
%
%   One of the processes may set Property of Subject; Own is true if Subject is a robot that does it.

changes(Names, S, Property, Subject, Own, Value) :-
    revision(S, Revision),
    effect(Revision, Head, fluent(Property, X), Value),
    functor(Head, Name, _),
    memberchk(Name, Names),
    (   var(X)
    ->  (   agent(Revision, Head, Robot), Robot == X
        ->  Own = true, is_one(Revision, Subject, 'Robot')
        ;   Own = false,
            (   parameter(Revision, Head, Y, Class), Y == X
            ->  is_one(Revision, Subject, Class)
            ;   true
            )
        )
    ;   Own = false,
        Subject = X
    ).

is_one(Revision, Subject, Class) :-
    ( var(Subject) -> true ; kind(Revision, Subject, Class) -> true ).

%!  lasting(+Condition, +Classes, +Names, +Situation) is semidet.
%
%   None of the processes Names changes what Condition asks for, nor does acting find it out. Classes are
%   those of its variables, as far as they are known.

lasting(Condition, Classes, Names, S) :-
    \+ ( sub_term(T, Condition), nonvar(T), T = is_true(_) ),
    \+ ( reads(Condition, Classes, S, Property, X),
         changes(Names, S, Property, X, _, _) ).

%   reads(+Term, +Classes, +Situation, ?Property, ?Subject) is nondet: a condition in Term asks for the
%   Property of Subject. Classes: the free variables and their classes, as far as they are known.
reads(Term, Classes, S, Property, X) :-
    nonvar(Term),
    reads_(Term, Classes, S, Property, X).

reads_(holds(Property, Subject, _), Classes, S, Property, X) :- !,
    subject(Subject, Classes, S, X).
reads_(value(Property, Subject), Classes, S, Property, X) :- !,
    subject(Subject, Classes, S, X).
reads_(fluent(Property, Subject), Classes, S, Property, X) :- !,    % an argument: data stay where they are
    names_one(Property, S),
    subject(Subject, Classes, S, X).
reads_(foreach(_, _, Vars, C, _, P), Classes, S, Property, X) :- !,
    append(Vars, Classes, Classes1),
    ( reads(C, Classes1, S, Property, X) ; reads(P, Classes1, S, Property, X) ).
reads_(interrupt(_, _, Vars, C, P), Classes, S, Property, X) :- !,
    append(Vars, Classes, Classes1),
    ( reads(C, Classes1, S, Property, X) ; reads(P, Classes1, S, Property, X) ).
reads_(pick(_, _, V, Class, P), Classes, S, Property, X) :- !,
    reads(P, [V-Class|Classes], S, Property, X).
reads_(some(Vars, C), Classes, S, Property, X) :- !,
    append(Vars, Classes, Classes1),
    reads(C, Classes1, S, Property, X).
reads_(Term, Classes, S, Property, X) :-
    compound(Term),
    arg(_, Term, Part),
    reads(Part, Classes, S, Property, X).

%   A process gives Property an individual, or a truth value.
names_one(Property, S) :-
    revision(S, Revision),
    effect(Revision, Head, fluent(Property, _), Value),
    ( nonvar(Value) -> true ; parameter(Revision, Head, X, _), X == Value ), !.

subject(Subject, Classes, S, X) :-
    (   nonvar(Subject)
    ->  X = Subject
    ;   member(Typed, Classes), nonvar(Typed), Typed = V-Class, V == Subject
    ->  revision(S, Revision),
        kind(Revision, X, Class)
    ;   true
    ).

%!  independent(+Program, +Situation) is semidet.
%
%   No step of Program changes a fluent that a condition, a precondition or an argument in it asks for,
%   nor where a robot is other than its own, and nothing in it has precedence over something else.

independent(P, S) :-
    called(P, S, Names),
    \+ ( program_part(P, Names, S, Part), prioritized(Part) ),
    \+ moves_others(Names, S),
    \+ ( program_part(P, Names, S, Part), asks(Part, S, Property, X),
         changes(Names, S, Property, X, _, _) ).

program_part(P, _, _, P).
program_part(_, Names, S, part(Head, C)) :-
    revision(S, Revision),
    precondition(Revision, Head, C),
    functor(Head, Name, _),
    memberchk(Name, Names).
program_part(_, Names, S, part(Head, Body)) :-
    revision(S, Revision),
    definition(Revision, Head, _, Body),
    functor(Head, Name, _),
    memberchk(Name, Names),
    \+ ( duration(Revision, Head, _), ahead(S, _) ).

asks(Part, S, Property, X) :-
    (   Part = part(Head, Term)
    ->  revision(S, Revision),
        classes(Revision, Head, Classes),
        reads(Term, Classes, S, Property, X)
    ;   reads(Part, [], S, Property, X)
    ).

%!  to_be_asked(+Program, +Situation, ?Property, ?Subject) is semidet.
%
%   Something that is still to be done may depend on this property of this individual: a condition, or a
%   precondition of a process that has not begun.

to_be_asked(P0, S, Property, Subject) :-
    to_come(P0, P),
    findall(Name/Arity,
            ( sub_term(T, P), nonvar(T), T = call(_, _, Head), nonvar(Head), functor(Head, Name, Arity) ),
            Found0),
    sort(Found0, Found),
    foldl(names_of(S), Found, [], Names),
    program_part(P, Names, S, Part),
    asks(Part, S, Property, Subject), !.

%   The parameters of Head and their classes.
classes(Revision, Head, Classes) :-
    functor(Head, Name, Arity),
    functor(General, Name, Arity),
    findall(N-Class,
            ( parameter(Revision, General, X, Class), between(1, Arity, N), arg(N, General, Y), Y == X ),
            Positions),
    maplist(argument_class(Head), Positions, Classes).

argument_class(Head, N-Class, V-Class) :-
    arg(N, Head, V).

%!  moves_others(+Names, +Situation) is semidet.
%
%   One of the processes may change where a robot is that does not do it.

moves_others(Names, S) :-
    revision(S, Revision),
    kind(Revision, Robot, 'Robot'),
    changes(Names, S, locatedAt, Robot, false, _), !.

%!  waits(+Program, +Situation) is semidet.
%
%   What happens in one branch of Program may let another go on: it waits for a condition, or looks at one
%   when its turn comes that another branch changes meanwhile, or a step for which no robot is idle before it
%   begins waits for a resource or a precondition.

waits(P0, S) :-
    to_come(P0, P),
    called(P, S, Names),
    (   waits_unseen(Names, S) -> true ; looks(P, Names, S) ).

waits_unseen(Names, S) :-
    revision(S, Revision),
    (   claims(Revision, Head, _)
    ;   precondition(Revision, Head, C), classes(Revision, Head, Classes),
        reads(C, Classes, S, Property, X),
        changes(Names, S, Property, X, _, _)
    ),
    functor(Head, Name, _),
    memberchk(Name, Names),
    \+ agent(Revision, Head, _), !.

looks(P, Names, S) :-
    program_part(P, Names, S, Part),
    part_term(Part, S, Term, Classes),
    sub_term(T, Term),
    nonvar(T),
    (   waiting(T)
    ->  true
    ;   asking(T, C, Vars),
        append(Vars, Classes, Classes1),
        reads(C, Classes1, S, Property, X),
        changes(Names, S, Property, X, _, _)
    ), !.

part_term(part(Head, Term), S, Term, Classes) :- !,
    revision(S, Revision),
    classes(Revision, Head, Classes).
part_term(Term, _, Term, []).

waiting(test(_)).
waiting(pconc(_)).
waiting(interrupt(_, _, _, _, _)).
waiting(search(_)).

asking(if(C, _, _), C, []).
asking(while(C, _), C, []).
asking(until(_, C), C, []).
asking(foreach(_, _, Vars, C, _, _), C, Vars).

prioritized(P) :-
    sub_term(T, P),
    nonvar(T),
    ( T = pconc(_) ; T = interrupt(_, _, _, _, _) ; T = deadline(_, _) ), !.
